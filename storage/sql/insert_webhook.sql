INSERT INTO webhook (id, url, secret, events, created_ms) VALUES (?1, ?2, ?3, ?4, ?5)
