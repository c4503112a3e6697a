-- One message to each webhook that asked for this end of a job.
INSERT INTO webhook_message (id, webhook, type, body, next_ms, created_ms)
SELECT 'msg_' || lower(hex(randomblob(16))), webhook.id, 'job.' || job.state,
       json_object('type', 'job.' || job.state, 'timestamp', strftime('%Y-%m-%dT%H:%M:%fZ', ?2 / 1000.0, 'unixepoch'),
                   'data', json_object('job', job.id, 'kind', job.kind, 'model', nullif(job.model, ''),
                                       'batch', job.batch, 'state', job.state)),
       ?2, ?2
  FROM job, webhook
 WHERE job.id = ?1 AND webhook.project = job.project AND job.state IN ('succeeded', 'failed', 'cancelled')
   AND EXISTS (SELECT 1 FROM json_each(webhook.events) WHERE value = 'job.' || job.state)
