SELECT seq, id, url, secret, events, created_ms FROM webhook WHERE id = ?1
