-- As list_subjects, of those with the external id ?4.
SELECT seq, id, name, region, external_id, created_ms FROM subject
 WHERE external_id = ?4 AND seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
