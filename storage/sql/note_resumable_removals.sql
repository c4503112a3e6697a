INSERT OR IGNORE INTO removal (kind, name) SELECT 'resumable', id FROM resumable WHERE subject = ?1
