SELECT seq, id, subject, template, sha256, content, suffix, bytes, facts, created_ms FROM bones WHERE id = ?1
