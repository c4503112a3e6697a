SELECT seq, id, url, secret, events, created_ms FROM webhook WHERE seq < ?1 ORDER BY seq DESC LIMIT ?2
