-- Strokes are named by the request of their job alone.
INSERT OR IGNORE INTO removal (kind, name)
SELECT 'blob', content FROM scan WHERE subject = ?1 UNION SELECT 'blob', content FROM bones WHERE subject = ?1
UNION SELECT 'blob', json_extract(file.value, '$.content') FROM job, json_each(job.request, '$.files') AS file
       WHERE instr(job.request, ?1) > 0
