SELECT seq, id, url, secret, events, created_ms FROM webhook
 WHERE seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
