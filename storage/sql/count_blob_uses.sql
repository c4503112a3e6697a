-- By what blobs_in_use.sql names. Requests without the digest are not taken apart.
SELECT (SELECT count(*) FROM scan WHERE content = ?1) + (SELECT count(*) FROM bones WHERE content = ?1)
     + (SELECT count(*) FROM model, json_each(model.request, '$.files') AS file
         WHERE instr(model.request, ?1) > 0 AND json_extract(file.value, '$.content') = ?1)
     + (SELECT count(*)
          FROM job JOIN job_request ON job_request.job = job.id, json_each(job_request.request, '$.files') AS file
         WHERE job.state IN ('queued', 'running') AND job.kind <> 'animation' AND instr(job_request.request, ?1) > 0
           AND json_extract(file.value, '$.content') = ?1)
