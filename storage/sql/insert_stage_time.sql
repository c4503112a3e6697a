INSERT INTO stage_time (job, kind, stage, position, begin, seconds, work) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)
