-- Strokes are named by the request of their job alone. Animations, whose requests are long, name no files.
INSERT OR IGNORE INTO removal (kind, name)
SELECT 'blob', content FROM scan WHERE subject = ?1 UNION SELECT 'blob', content FROM bones WHERE subject = ?1
UNION SELECT 'blob', json_extract(file.value, '$.content')
        FROM job JOIN job_request ON job_request.job = job.id, json_each(request, '$.files') AS file
       WHERE job.subject = ?1 AND job.kind <> 'animation'
