INSERT INTO job_request (job, request) VALUES (?1, ?2)
