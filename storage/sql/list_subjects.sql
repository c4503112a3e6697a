-- Newest first; ?1 is the seq the page starts below.
SELECT seq, id, name, region, external_id, created_ms FROM subject WHERE seq < ?1 ORDER BY seq DESC LIMIT ?2
