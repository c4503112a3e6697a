INSERT OR IGNORE INTO removal (kind, name) SELECT 'model', id FROM model WHERE subject = ?1
