// What the server answers to requests that may be answered: no HTTP in here.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "view/session.h"

namespace kpsa::engine {

struct Answer {
  int status = 200;
  const char* type = "application/json";
  std::shared_ptr<const std::string> body;
};
Answer Refusal(int status, const Status& problems);

// The answer to GET `path`, which is decoded; `number` is the query's `after` or `vertex`, "" where it has none. May
// wait for a change.
Answer AnswerGet(Session* session, std::string_view path, std::string_view number);
// To POST /evaluate and /pose-file, of any bytes.
Answer AnswerPost(Session* session, std::string_view path, std::string_view body);

}  // namespace kpsa::engine
