INSERT INTO subject (id, name, region, external_id, created_ms, project) VALUES (?1, ?2, ?3, ?4, ?5, ?6)
