-- Schema version 3: projects, API keys, what was used of quotas, the audit trail.
-- The table of subjects is made anew: an external id is unique in its project, not in the whole service.
CREATE TABLE subject_of_project (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  project TEXT NOT NULL,
  name TEXT,
  region TEXT NOT NULL,
  external_id TEXT,
  created_ms INTEGER NOT NULL,
  UNIQUE (project, external_id)
) STRICT;
INSERT INTO subject_of_project SELECT seq, id, 'default', name, region, external_id, created_ms FROM subject;
DROP TABLE subject;
ALTER TABLE subject_of_project RENAME TO subject;

UPDATE idempotency SET scope = 'default ' || scope;
ALTER TABLE job ADD COLUMN project TEXT NOT NULL DEFAULT 'default';
ALTER TABLE batch ADD COLUMN project TEXT NOT NULL DEFAULT 'default';
ALTER TABLE webhook ADD COLUMN project TEXT NOT NULL DEFAULT 'default';

CREATE TABLE api_key (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  name TEXT NOT NULL,
  project TEXT NOT NULL,
  scope TEXT NOT NULL CHECK (scope IN ('read', 'write', 'admin')),
  secret_sha256 TEXT NOT NULL,         -- of 160 random bits: a slow hash would add nothing
  requests_per_minute INTEGER,         -- NULL: the service's default
  bytes_per_day INTEGER,
  created_ms INTEGER NOT NULL,
  expires_ms INTEGER,
  revoked_ms INTEGER
) STRICT;

CREATE TABLE quota_use (
  who TEXT NOT NULL,
  day INTEGER NOT NULL,                -- days since 1970, UTC
  bytes INTEGER NOT NULL,
  PRIMARY KEY (who, day)
) STRICT, WITHOUT ROWID;

-- Each entry's hash covers the one before: what was changed, taken out or put in between shows.
CREATE TABLE audit (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  at_ms INTEGER NOT NULL,
  who TEXT NOT NULL,
  project TEXT NOT NULL,
  action TEXT NOT NULL,
  object TEXT NOT NULL,
  outcome TEXT NOT NULL,
  hash TEXT NOT NULL
) STRICT;
CREATE TRIGGER audit_is_not_changed BEFORE UPDATE ON audit BEGIN SELECT raise(ABORT, 'the audit trail is append-only'); END;
CREATE TRIGGER audit_is_not_deleted BEFORE DELETE ON audit BEGIN SELECT raise(ABORT, 'the audit trail is append-only'); END;

-- Bytes of deleted records that are still to be removed: blobs, models, unfinished uploads.
CREATE TABLE removal (kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (kind, name)) STRICT, WITHOUT ROWID;
CREATE INDEX scan_of_blob ON scan (content);
CREATE INDEX bones_of_blob ON bones (content);
CREATE INDEX model_of_subject ON model (subject);
CREATE INDEX job_of_model ON job (model);
