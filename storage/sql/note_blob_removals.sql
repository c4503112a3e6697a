INSERT OR IGNORE INTO removal (kind, name)
SELECT 'blob', content FROM scan WHERE subject = ?1 UNION SELECT 'blob', content FROM bones WHERE subject = ?1
