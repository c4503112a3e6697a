-- Names are proposed as the region has them, so what is known holds for subjects of the same one.
SELECT seq, id, subject, template, sha256, content, suffix, bytes, facts, created_ms FROM bones
 WHERE sha256 = ?1 AND (?3 IS NULL OR (SELECT project FROM subject WHERE subject.id = bones.subject) = ?3)
   AND (SELECT region FROM subject WHERE subject.id = bones.subject) = ?4
 ORDER BY seq DESC LIMIT ?2
