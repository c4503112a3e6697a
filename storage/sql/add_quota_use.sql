INSERT INTO quota_use (who, day, bytes) VALUES (?1, ?2, ?3)
ON CONFLICT (who, day) DO UPDATE SET bytes = bytes + excluded.bytes
