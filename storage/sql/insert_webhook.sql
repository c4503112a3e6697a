INSERT INTO webhook (id, url, secret, events, created_ms, project) VALUES (?1, ?2, ?3, ?4, ?5, ?6)
