DELETE FROM resumable WHERE expires_ms <= ?1 RETURNING id
