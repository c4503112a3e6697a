// What lies beside the records: uploads (a file, or the folder of a series), models, artefacts. None changes
// once it has its name, but for a model's document.
#pragma once
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/host/progress.h"
#include "storage/backup/backup_figures.h"

namespace kvx {

constexpr const char* kCopying = ".copying";  // ends the name of what is not whole yet

// Copies what `to` has not. Uploads are read again as they were copied: one that is not whole in `from` is
// left out, and one that is whole in `to` stays. Throws Denied or Unavailable, which say of which side.
void CopyFiles(const std::filesystem::path& from, const std::filesystem::path& to, CopiedBefore before,
               BackupFigures& figures, const Progress& progress);

// What an older backup has of ours and the data folder has not, as paths within both.
std::vector<std::filesystem::path> WhatWent(const std::filesystem::path& data,
                                            const std::filesystem::path& backup);

// But for uploads and models that are `named`, and for what has come again meanwhile.
void RemoveWhatWent(const std::vector<std::filesystem::path>& went, const std::set<std::string>& named,
                    const std::filesystem::path& data, const std::filesystem::path& backup);

// Where an upload or a model of that name lies.
std::filesystem::path PathOf(const std::filesystem::path& root, const std::string& name);

bool HasFoldersOfFiles(const std::filesystem::path& root);

}  // namespace kvx
