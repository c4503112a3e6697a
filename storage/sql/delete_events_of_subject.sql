DELETE FROM job_event WHERE job IN
  (SELECT id FROM job WHERE model IN (SELECT id FROM model WHERE subject = ?1) OR instr(request, ?1) > 0)
