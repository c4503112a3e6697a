SELECT model.seq, model.id, model.subject, template, model.job, digest, model.created_ms, job.state
  FROM model JOIN job ON job.id = model.job WHERE model.id = ?1
   AND (?2 IS NULL OR (SELECT project FROM subject WHERE subject.id = model.subject) = ?2)
