SELECT seq, id, subject, name, sha256, content, suffix, bytes, facts, created_ms FROM scan WHERE id = ?1
   AND (?2 IS NULL OR (SELECT project FROM subject WHERE subject.id = scan.subject) = ?2)
