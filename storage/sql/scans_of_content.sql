SELECT seq, id, subject, name, sha256, content, suffix, bytes, facts, created_ms FROM scan
 WHERE sha256 = ?1 AND (?3 IS NULL OR (SELECT project FROM subject WHERE subject.id = scan.subject) = ?3)
 ORDER BY seq DESC LIMIT ?2
