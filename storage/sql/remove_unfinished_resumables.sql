DELETE FROM resumable WHERE location IS NULL
