SELECT seq, id, name, created_ms FROM batch WHERE seq < ?1 ORDER BY seq DESC LIMIT ?2
