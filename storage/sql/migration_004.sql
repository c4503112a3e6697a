-- Schema version 4: lists that are searched. The queue asks for jobs by their state, too.
CREATE INDEX subject_of_external_id ON subject (external_id) WHERE external_id IS NOT NULL;
CREATE INDEX job_of_state ON job (state);
