SELECT seq, id, name, created_ms FROM batch WHERE id = ?1 AND (?2 IS NULL OR project = ?2)
