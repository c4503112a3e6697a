SELECT seq, id, subject, template, sha256, content, suffix, bytes, facts, created_ms FROM bones WHERE id = ?1
   AND (?2 IS NULL OR (SELECT project FROM subject WHERE subject.id = bones.subject) = ?2)
