-- Schema version 2: what jobs declare and how often their worker was lost.
ALTER TABLE job ADD COLUMN need_bytes INTEGER NOT NULL DEFAULT 0;    -- memory that a run takes, as declared
ALTER TABLE job ADD COLUMN workers_lost INTEGER NOT NULL DEFAULT 0;  -- leases that ran out in the middle of a run
ALTER TABLE job ADD COLUMN work REAL NOT NULL DEFAULT 0;             -- size in units of its kind, for time estimates
ALTER TABLE job ADD COLUMN batch TEXT;

-- What stages took, newest last; `work` is that of the job.
CREATE TABLE stage_time (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  job TEXT NOT NULL,
  kind TEXT NOT NULL,
  stage TEXT NOT NULL,
  position INTEGER NOT NULL,   -- 0 for the first stage of the job
  begin REAL NOT NULL,         -- the fraction of the whole at which it began
  seconds REAL NOT NULL,
  work REAL NOT NULL
) STRICT;
CREATE INDEX stage_time_of_kind ON stage_time (kind, seq);
CREATE INDEX stage_time_of_job ON stage_time (job);

-- Resumable uploads (tus). The bytes lie in uploads/<id>; only what is counted here is surely on disk.
CREATE TABLE resumable (
  id TEXT PRIMARY KEY,
  subject TEXT NOT NULL REFERENCES subject(id) ON DELETE CASCADE,
  kind TEXT NOT NULL,          -- scan or bones
  parameters TEXT NOT NULL,    -- JSON: the query of the plain upload
  sha256 TEXT,                 -- of the whole file, as the client announced it
  length INTEGER NOT NULL,
  received INTEGER NOT NULL DEFAULT 0,
  metadata TEXT NOT NULL,      -- as sent
  location TEXT,               -- of the record it became
  created_ms INTEGER NOT NULL,
  expires_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX resumable_expiry ON resumable (expires_ms);

CREATE INDEX scan_of_content ON scan (sha256);
CREATE INDEX bones_of_content ON bones (sha256);

CREATE TABLE batch (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  name TEXT,
  created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX job_of_batch ON job (batch, seq) WHERE batch IS NOT NULL;

-- Webhooks, and the outbox that is filled in the transaction that ends a job.
CREATE TABLE webhook (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  url TEXT NOT NULL,
  secret TEXT NOT NULL,
  events TEXT NOT NULL,        -- JSON list of event types
  created_ms INTEGER NOT NULL
) STRICT;

CREATE TABLE webhook_message (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  webhook TEXT NOT NULL REFERENCES webhook(id) ON DELETE CASCADE,
  type TEXT NOT NULL,
  body TEXT NOT NULL,
  attempt INTEGER NOT NULL DEFAULT 0,
  next_ms INTEGER NOT NULL,
  state TEXT NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'delivered', 'given_up')),
  answer TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX webhook_message_due ON webhook_message (next_ms) WHERE state = 'waiting';
