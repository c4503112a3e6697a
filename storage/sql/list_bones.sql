SELECT seq, id, subject, template, sha256, content, suffix, bytes, facts, created_ms FROM bones
 WHERE subject = ?1 AND seq < ?2 ORDER BY seq DESC LIMIT ?3
