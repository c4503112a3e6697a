SELECT request FROM job_request WHERE job = ?1
