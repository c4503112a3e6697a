SELECT seq, id, subject, template, sha256, content, suffix, bytes, facts, created_ms FROM bones
 WHERE sha256 = ?1 ORDER BY seq DESC LIMIT ?2
