-- Schema version 2: what jobs declare and how often their worker was lost.
ALTER TABLE job ADD COLUMN need_bytes INTEGER NOT NULL DEFAULT 0;    -- memory that a run takes, as declared
ALTER TABLE job ADD COLUMN workers_lost INTEGER NOT NULL DEFAULT 0;  -- leases that ran out in the middle of a run
