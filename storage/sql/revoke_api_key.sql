UPDATE api_key SET revoked_ms = coalesce(revoked_ms, ?2) WHERE id = ?1
