-- Schema version 6: when a project began a job last is found at once; projects take turns by it.
CREATE INDEX job_begun ON job (project, started_ms);
