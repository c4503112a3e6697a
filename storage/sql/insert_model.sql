INSERT INTO model (id, subject, template, request, job, created_ms) VALUES (?1, ?2, ?3, ?4, ?5, ?6)
