-- Newest first; of one project, or of all.
SELECT seq, at_ms, who, project, action, object, outcome, hash FROM audit
 WHERE seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
