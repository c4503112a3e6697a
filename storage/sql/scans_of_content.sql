SELECT seq, id, subject, name, sha256, content, suffix, bytes, facts, created_ms FROM scan
 WHERE sha256 = ?1 ORDER BY seq DESC LIMIT ?2
