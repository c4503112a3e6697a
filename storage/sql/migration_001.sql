-- Schema version 1. `seq` orders lists and cursors; `id` is what the world sees. Times are UTC milliseconds.
CREATE TABLE subject (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  name TEXT,
  region TEXT NOT NULL,
  external_id TEXT UNIQUE,
  created_ms INTEGER NOT NULL
) STRICT;

CREATE TABLE scan (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  subject TEXT NOT NULL REFERENCES subject(id),
  name TEXT NOT NULL,
  sha256 TEXT NOT NULL,        -- of the bytes as uploaded
  content TEXT NOT NULL,       -- blob that holds them (a folder for a DICOM series)
  suffix TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  facts TEXT NOT NULL,         -- JSON: size, spacing, origin, direction, modality, type
  created_ms INTEGER NOT NULL,
  UNIQUE (subject, name)
) STRICT;

CREATE TABLE bones (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  subject TEXT NOT NULL REFERENCES subject(id),
  template TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  content TEXT NOT NULL,
  suffix TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  facts TEXT NOT NULL,
  created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX bones_of_template ON bones (subject, template, seq);

CREATE TABLE model (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  subject TEXT NOT NULL REFERENCES subject(id),
  template TEXT NOT NULL,
  request TEXT NOT NULL,       -- JSON: what the builder needs, files by blob
  job TEXT NOT NULL,
  digest TEXT,                 -- set when built
  created_ms INTEGER NOT NULL
) STRICT;

CREATE TABLE job (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  model TEXT NOT NULL,
  request TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
  priority INTEGER NOT NULL,
  attempt INTEGER NOT NULL DEFAULT 0,
  max_attempts INTEGER NOT NULL,
  not_before_ms INTEGER NOT NULL DEFAULT 0,
  worker TEXT,
  lease_token TEXT,
  lease_until_ms INTEGER NOT NULL DEFAULT 0,
  cancel_requested INTEGER NOT NULL DEFAULT 0,
  stage TEXT NOT NULL DEFAULT '',
  progress REAL NOT NULL DEFAULT 0,
  error TEXT,                  -- JSON: type, detail
  result TEXT,                 -- JSON
  created_ms INTEGER NOT NULL,
  started_ms INTEGER,
  finished_ms INTEGER
) STRICT;
CREATE INDEX job_claimable ON job (priority DESC, seq) WHERE state IN ('queued', 'running');

CREATE TABLE job_event (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  job TEXT NOT NULL REFERENCES job(id),
  at_ms INTEGER NOT NULL,
  state TEXT NOT NULL,
  stage TEXT NOT NULL,
  progress REAL NOT NULL,
  attempt INTEGER NOT NULL
) STRICT;
CREATE INDEX job_event_of_job ON job_event (job, id);

CREATE TABLE idempotency (
  scope TEXT NOT NULL,         -- method and path
  key TEXT NOT NULL,
  request_digest TEXT NOT NULL,
  status INTEGER NOT NULL,
  location TEXT NOT NULL,
  body TEXT NOT NULL,
  created_ms INTEGER NOT NULL,
  PRIMARY KEY (scope, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE pulse (one INTEGER PRIMARY KEY CHECK (one = 1), at_ms INTEGER NOT NULL) STRICT;
