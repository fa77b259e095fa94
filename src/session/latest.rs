//! A thread of its own that answers the latest of what it is asked: what was asked before, and not begun, is passed
//! over.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};

use super::wake::Wake;

/// An answer, or why there is none in the user's terms.
pub type Reply<A> = Result<A, String>;

/// The end of whoever asks.
pub struct Latest<Q, A> {
    questions: Sender<Q>,
    replies: Receiver<Reply<A>>,
}

/// The thread's end.
pub struct LatestDesk<Q, A> {
    inbox: Receiver<Q>,
    outbox: Sender<Reply<A>>,
    wake: Wake,
}

impl<Q: Send + 'static, A: Send + 'static> Latest<Q, A> {
    /// `serve` answers questions from the one it is given on, keeps what they share, and returns the first that needs
    /// something else; nothing where nobody asks any more. Where it breaks, `broken` is said.
    pub fn start(
        wake: &Wake,
        broken: &'static str,
        serve: fn(Q, &LatestDesk<Q, A>) -> Option<Q>,
    ) -> Self {
        let (questions, inbox) = channel();
        let (outbox, replies) = channel();
        let desk = LatestDesk {
            inbox,
            outbox,
            wake: wake.clone(),
        };
        std::thread::spawn(move || {
            let mut next = desk.wait();
            while let Some(question) = next.take() {
                let shared = AssertUnwindSafe(|| serve(question, &desk));
                next = catch_unwind(shared).unwrap_or_else(|_| {
                    desk.answer(Err(broken.into()));
                    desk.wait()
                });
            }
        });
        Self { questions, replies }
    }

    /// Whether anybody is there to answer.
    pub fn ask(&self, question: Q) -> bool {
        self.questions.send(question).is_ok()
    }

    /// What was answered since the last call.
    pub fn answers(&self) -> impl Iterator<Item = Reply<A>> + '_ {
        self.replies.try_iter()
    }
}

impl<Q, A> LatestDesk<Q, A> {
    pub fn answer(&self, reply: Reply<A>) {
        // Nobody listens any more when the session was closed meanwhile.
        let _ = self.outbox.send(reply);
        self.wake.now();
    }

    /// The latest question, this one where none is newer.
    #[must_use]
    pub fn latest(&self, question: Q) -> Q {
        self.inbox.try_iter().last().unwrap_or(question)
    }

    /// The next question; nothing when there will be none.
    #[must_use]
    pub fn wait(&self) -> Option<Q> {
        self.inbox.recv().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers with the tens that a question shares with the first, and the question.
    fn serve(first: u32, desk: &LatestDesk<u32, (u32, u32)>) -> Option<u32> {
        let tens = first / 10;
        let mut question = first;
        loop {
            question = desk.latest(question);
            if question / 10 != tens {
                return Some(question);
            }
            assert_ne!(question, 13);
            desk.answer(Ok((tens, question)));
            question = desk.wait()?;
        }
    }

    fn next(worker: &Latest<u32, (u32, u32)>) -> Reply<(u32, u32)> {
        loop {
            if let Some(reply) = worker.answers().next() {
                return reply;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn what_is_shared_changes_with_the_question_and_a_panic_ends_nothing() {
        let worker = Latest::start(&Wake::default(), "broken", serve);
        for question in [11, 12, 27, 21] {
            assert!(worker.ask(question));
            assert_eq!(next(&worker), Ok((question / 10, question)));
        }
        assert!(worker.ask(13));
        assert_eq!(next(&worker), Err("broken".to_owned()));
        assert!(worker.ask(12));
        assert_eq!(next(&worker), Ok((1, 12)));
    }

    #[test]
    fn only_the_latest_question_is_answered() {
        let (questions, inbox) = channel();
        let (outbox, _replies) = channel::<Reply<()>>();
        let desk = LatestDesk {
            inbox,
            outbox,
            wake: Wake::default(),
        };
        assert_eq!(desk.latest(1), 1);
        for question in [2, 3, 4] {
            questions.send(question).unwrap();
        }
        assert_eq!(desk.latest(1), 4);
        drop(questions);
        assert_eq!(desk.wait(), None);
    }
}
