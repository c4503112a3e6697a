INSERT INTO batch (id, name, created_ms) VALUES (?1, ?2, ?3)
