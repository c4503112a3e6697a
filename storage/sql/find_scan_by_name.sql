SELECT seq, id, subject, name, sha256, content, suffix, bytes, facts, created_ms FROM scan
 WHERE subject = ?1 AND name = ?2
