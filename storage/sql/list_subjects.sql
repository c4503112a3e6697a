-- Newest first; ?1 is the seq the page starts below.
SELECT seq, id, name, region, external_id, created_ms FROM subject
 WHERE seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
