SELECT model.seq, model.id, model.subject, template, model.job, digest, model.created_ms, job.state
  FROM model JOIN job ON job.id = model.job WHERE model.subject = ?4 AND model.seq < ?1
   AND (?3 IS NULL OR (SELECT project FROM subject WHERE subject.id = model.subject) = ?3)
 ORDER BY model.seq DESC LIMIT ?2
