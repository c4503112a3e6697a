INSERT INTO batch (id, name, created_ms, project) VALUES (?1, ?2, ?3, ?4)
