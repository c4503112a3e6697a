SELECT seq, id, url, secret, events, created_ms FROM webhook WHERE id = ?1 AND (?2 IS NULL OR project = ?2)
