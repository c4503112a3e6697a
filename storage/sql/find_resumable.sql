SELECT id, subject, kind, parameters, sha256, length, received, metadata, location, expires_ms FROM resumable WHERE id = ?1
