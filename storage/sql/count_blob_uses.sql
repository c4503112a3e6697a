-- By what blobs_in_use.sql names.
SELECT (SELECT count(*) FROM scan WHERE content = ?1) + (SELECT count(*) FROM bones WHERE content = ?1)
     + (SELECT count(*) FROM model, json_each(model.request, '$.files') AS file
         WHERE json_extract(file.value, '$.content') = ?1)
     + (SELECT count(*) FROM job, json_each(job.request, '$.files') AS file
         WHERE job.state IN ('queued', 'running') AND json_extract(file.value, '$.content') = ?1)
