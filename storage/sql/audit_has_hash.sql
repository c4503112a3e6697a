SELECT 1 FROM audit WHERE hash = :hash
