SELECT seq, id, name, created_ms FROM batch
 WHERE seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
