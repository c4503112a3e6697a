SELECT id FROM subject WHERE external_id = ?1 AND project = ?2
