DELETE FROM idempotency WHERE created_ms < ?1
