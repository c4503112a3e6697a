SELECT count(*) FROM job
 WHERE state IN ('queued', 'running') AND (model IN (SELECT id FROM model WHERE subject = ?1) OR instr(request, ?1) > 0)
