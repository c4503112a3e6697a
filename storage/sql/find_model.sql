SELECT model.seq, model.id, subject, template, model.request, model.job, digest, model.created_ms, job.state
  FROM model JOIN job ON job.id = model.job WHERE model.id = ?1
