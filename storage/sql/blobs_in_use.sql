-- Names of all blobs that a record or the request of a model or a job holds on to.
SELECT content FROM scan
UNION SELECT content FROM bones
UNION SELECT json_extract(file.value, '$.content') FROM model, json_each(model.request, '$.files') AS file
UNION SELECT json_extract(file.value, '$.content')
        FROM job JOIN job_request ON job_request.job = job.id, json_each(job_request.request, '$.files') AS file
       WHERE job.state IN ('queued', 'running') AND job.kind <> 'animation'
