SELECT seq, id, name, region, external_id, created_ms FROM subject WHERE id = ?1
