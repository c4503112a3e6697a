-- Only under the data folder's lock: no other process can hold a lease.
UPDATE job SET lease_until_ms = 0 WHERE state = 'running'
