-- Oldest first, above ?1.
SELECT seq, at_ms, who, project, action, object, outcome, hash FROM audit WHERE seq > ?1 ORDER BY seq LIMIT ?2
