DELETE FROM job_event WHERE job IN (SELECT id FROM job WHERE subject = ?1)
