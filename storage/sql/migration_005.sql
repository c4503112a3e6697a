-- Schema version 5: jobs know their subject, and what a job runs on lies beside it: a long motion has megabytes, which no list
-- and no change of the job reads or writes.
CREATE TABLE job_request (
  job TEXT PRIMARY KEY REFERENCES job(id) ON DELETE CASCADE,
  request TEXT NOT NULL        -- JSON, for the run function of the job's kind
) STRICT;
INSERT INTO job_request SELECT id, request FROM job;
ALTER TABLE job DROP COLUMN request;
ALTER TABLE job ADD COLUMN subject TEXT REFERENCES subject(id);
UPDATE job SET subject = (SELECT subject FROM model WHERE model.id = job.model) WHERE model <> '';
UPDATE job SET subject = (SELECT subject.id FROM job_request JOIN subject ON subject.id = json_extract(request, '$.subject')
                           WHERE job_request.job = job.id) WHERE kind = 'segment_bones';
CREATE INDEX job_of_subject ON job (subject);

-- Of subjects that were removed just as these were asked for: no removal would reach them any more.
CREATE TEMP TABLE stray AS SELECT id FROM job WHERE subject IS NULL AND kind IN ('segment_bones', 'animation');
INSERT OR IGNORE INTO removal (kind, name)
SELECT 'blob', json_extract(file.value, '$.content') FROM job_request, json_each(request, '$.files') AS file
 WHERE job_request.job IN (SELECT id FROM stray);
DELETE FROM job_event WHERE job IN (SELECT id FROM stray);
DELETE FROM job_request WHERE job IN (SELECT id FROM stray);
DELETE FROM job WHERE id IN (SELECT id FROM stray);
DROP TABLE stray;
