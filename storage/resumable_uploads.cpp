// The file may be longer than what is counted, after a crash: the next writer cuts it back.
#include "storage/resumable_uploads.h"

#include <fcntl.h>
#include <unistd.h>

#include <mutex>
#include <set>

#include "storage/database/sqlite.h"
#include "storage/ids.h"

namespace kvx {
namespace {

using sqlite::Integer;
using sqlite::OptionalText;
using sqlite::Text;

constexpr char kNotStored[] = "the upload cannot be stored; is the disk full?";

ResumableUpload Row(SQLite::Statement& row) {
  ResumableUpload upload;
  upload.id = Text(row, 0), upload.subject = Text(row, 1), upload.kind = Text(row, 2),
  upload.parameters = Text(row, 3);
  upload.sha256 = OptionalText(row, 4);
  upload.length = Integer(row, 5), upload.received = Integer(row, 6);
  upload.metadata = Text(row, 7);
  upload.location = OptionalText(row, 8);
  upload.expires_ms = Integer(row, 9);
  return upload;
}

// After a crash between placing the whole and recording it, the file is a blob as well:
// what follows must not change that.
void Separate(const std::filesystem::path& path, int64_t bytes) {
  std::error_code error;
  if (std::filesystem::hard_link_count(path, error) < 2 || error) return;
  const std::filesystem::path copy = path.string() + ".copy";
  std::filesystem::copy_file(path, copy, std::filesystem::copy_options::overwrite_existing, error);
  if (!error) std::filesystem::resize_file(copy, uintmax_t(bytes), error);
  if (!error) std::filesystem::rename(copy, path, error);
  if (error) throw Unavailable(kNotStored);
}

int64_t BytesOf(const std::filesystem::path& file) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  return error ? 0 : int64_t(bytes);
}

}  // namespace

struct ResumableUploads::State {
  std::mutex mutex;
  std::set<std::string> writing;
};

ResumableUploads::ResumableUploads(Database& db, std::filesystem::path folder, int64_t lifetime_ms)
    : db_(db), folder_(std::move(folder)), lifetime_ms_(lifetime_ms), state_(std::make_unique<State>()) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw Unavailable("the data folder cannot be written; give another with --data");
}

ResumableUploads::~ResumableUploads() = default;

ResumableUpload ResumableUploads::Create(ResumableUpload upload) {
  upload.id = NewId("upl");
  upload.expires_ms = db_.NowMs() + lifetime_ms_;
  db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "insert_resumable", upload.id, upload.subject, upload.kind, upload.parameters,
                    upload.sha256, upload.length, upload.metadata, db_.NowMs(), upload.expires_ms);
  });
  return upload;
}

ResumableUpload ResumableUploads::Require(const std::string& id) {
  auto found = db_.Read([&](SQLite::Database& db) { return sqlite::One(db, "find_resumable", Row, id); });
  if (!found) throw NotFound("there is no such upload; it may have ended long ago");
  if (found->expires_ms <= db_.NowMs()) throw Gone("the upload has expired; start it again");
  // As in a folder put together from a copy: to go on after what is missing would leave a hole.
  if (!found->location && BytesOf(PathOf(id)) < found->received)
    throw Gone("what came of the upload is lost; start it again");
  return *std::move(found);
}

int ResumableUploads::CountOpen(const std::string& subject) {
  const auto count = [](SQLite::Statement& row) { return int(Integer(row, 0)); };
  return db_.Read([&](SQLite::Database& db) {
    return *sqlite::One(db, "count_open_resumables", count, subject, db_.NowMs());
  });
}

void ResumableUploads::Remove(const std::string& id) {
  Require(id);
  const auto alone = Continue(id);
  db_.Write([&](SQLite::Database& db) { sqlite::Execute(db, "remove_resumable", id); });
  std::error_code ignored;
  std::filesystem::remove(PathOf(id), ignored);
}

int ResumableUploads::RemoveExpired() {
  const auto ids = db_.Write([&](SQLite::Database& db) {
    return sqlite::All(
        db, "remove_expired_resumables", [](SQLite::Statement& row) { return Text(row, 0); }, db_.NowMs());
  });
  std::error_code ignored;
  for (const std::string& id : ids) std::filesystem::remove(PathOf(id), ignored);
  // Bytes without a row: their subject is gone, or the row was removed a moment before a crash.
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    const std::string id = entry.path().filename().string();
    const auto row =
        db_.Read([&](SQLite::Database& db) { return sqlite::One(db, "find_resumable", Row, id); });
    if (!row) std::filesystem::remove(entry.path(), ignored);
  }
  return int(ids.size());
}

std::unique_ptr<ResumableUploads::Writer> ResumableUploads::Continue(const std::string& id) {
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->writing.insert(id).second) {
      throw Locked("another request writes to this upload; ask again for its offset in a moment");
    }
  }
  try {
    return std::unique_ptr<Writer>(new Writer(*this, Require(id)));
  } catch (...) {
    Unlock(id);
    throw;
  }
}

void ResumableUploads::Unlock(const std::string& id) {
  const std::lock_guard lock(state_->mutex);
  state_->writing.erase(id);
}

ResumableUploads::Writer::Writer(ResumableUploads& owner, ResumableUpload upload)
    : owner_(owner), upload_(std::move(upload)), offset_(upload_.received) {
  if (upload_.location) return;  // finished: its bytes have gone
  Separate(path(), offset_);
  file_ = ::open(path().c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  const bool ready =
      file_ >= 0 && ::ftruncate(file_, offset_) == 0 && ::lseek(file_, offset_, SEEK_SET) == offset_;
  if (ready) return;
  if (file_ >= 0) ::close(file_);
  throw Unavailable(kNotStored);
}

ResumableUploads::Writer::~Writer() {
  if (file_ >= 0) ::close(file_);
  owner_.Unlock(upload_.id);
}

std::filesystem::path ResumableUploads::Writer::path() const { return owner_.PathOf(upload_.id); }

void ResumableUploads::Writer::Write(std::span<const char> bytes) {
  if (int64_t(bytes.size()) > upload_.length - offset_) {
    throw InputError("the upload is longer than its Upload-Length said");
  }
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written <= 0) throw Unavailable(kNotStored);
    bytes = bytes.subspan(size_t(written));
    offset_ += written;
  }
}

void ResumableUploads::Writer::Keep() {
  if (file_ >= 0 && ::fsync(file_) != 0) throw Unavailable(kNotStored);
  if (Complete() || offset_ == upload_.received) return;
  owner_.db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "keep_resumable", upload_.id, offset_, owner_.db_.NowMs() + owner_.lifetime_ms_);
  });
  upload_.received = offset_;
}

void ResumableUploads::Writer::Finish(const std::string& location) {
  owner_.db_.Write(
      [&](SQLite::Database& db) { sqlite::Execute(db, "finish_resumable", upload_.id, location); });
  upload_.received = upload_.length;
  upload_.location = location;
}

}  // namespace kvx
