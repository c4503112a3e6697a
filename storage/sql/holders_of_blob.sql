-- Ids of what was uploaded as it: scans and label maps, else the models and jobs whose requests hold on to it.
WITH holder (id, direct) AS (
  SELECT id, 1 FROM scan WHERE content = ?1
  UNION SELECT id, 1 FROM bones WHERE content = ?1
  UNION SELECT model.id, 0 FROM model, json_each(model.request, '$.files') AS file
         WHERE json_extract(file.value, '$.content') = ?1
  UNION SELECT job.id, 0
          FROM job JOIN job_request ON job_request.job = job.id, json_each(job_request.request, '$.files') AS file
         WHERE json_extract(file.value, '$.content') = ?1
)
SELECT id FROM holder WHERE direct = (SELECT max(direct) FROM holder) ORDER BY id
