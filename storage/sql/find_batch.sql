SELECT seq, id, name, created_ms FROM batch WHERE id = ?1
