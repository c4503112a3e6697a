SELECT seq, id, name, region, external_id, created_ms FROM subject
 WHERE id = ?1 AND (?2 IS NULL OR project = ?2)
