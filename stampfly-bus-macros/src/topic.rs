//! A line of the topic table and a participant, as the generated code needs them.

use crate::input::{Attributes, type_name};
use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{quote, quote_spanned};

/// How a topic keeps its samples.
pub enum Policy {
    Latest,
    Ring(TokenStream),
    Queue(TokenStream),
}

/// One line of the table.
pub struct Topic {
    pub attributes: Attributes,
    pub name: Ident,
    pub message: TokenStream,
    pub policy: Policy,
    /// As written, for people.
    pub rate: String,
    /// Microseconds between two samples; `None` when they come on events.
    pub period: Option<u64>,
    pub publisher: Ident,
    pub readers: Vec<Ident>,
    /// Is it the newest sample of a runnable for other runnables?
    pub within: bool,
}

/// Somebody who publishes or reads.
pub struct Participant<'t> {
    pub name: &'t Ident,
    pub outside: bool,
    pub publishes: Vec<&'t Topic>,
    /// The topic, and which of its readers this one is.
    pub reads: Vec<(&'t Topic, usize)>,
}

pub fn doc_or(doc: &[Literal], otherwise: &str) -> TokenStream {
    if doc.is_empty() { quote!(#[doc = #otherwise]) } else { quote!(#(#[doc = #doc])*) }
}

impl Topic {
    pub fn policy_type(&self) -> TokenStream {
        match self.policy {
            Policy::Latest => quote!(::stampfly_bus::Latest),
            Policy::Ring(_) => quote!(::stampfly_bus::Every),
            Policy::Queue(_) => quote!(::stampfly_bus::Lossless),
        }
    }

    pub fn policy_name(&self) -> &'static str {
        match self.policy {
            Policy::Latest => "latest",
            Policy::Ring(_) => "ring",
            Policy::Queue(_) => "queue",
        }
    }

    pub fn depth(&self) -> TokenStream {
        match &self.policy {
            Policy::Latest => quote!(::stampfly_bus::LATEST_DEPTH),
            Policy::Ring(depth) | Policy::Queue(depth) => depth.clone(),
        }
    }

    /// Readers whose cursors the publisher must respect.
    pub fn required(&self) -> usize {
        if matches!(self.policy, Policy::Queue(_)) { self.readers.len() } else { 0 }
    }

    /// The message, at its own place in the source: what is wrong with it is reported there.
    pub fn words(&self) -> TokenStream {
        let message = &self.message;
        let at = message.clone().into_iter().next().map_or_else(Span::call_site, |token| token.span());
        quote_spanned!(at => { <#message as ::stampfly_bus::Message>::WORDS })
    }

    pub fn publisher_type(&self) -> TokenStream {
        let (message, policy, depth, words, required) =
            (&self.message, self.policy_type(), self.depth(), self.words(), self.required());
        if self.within {
            return quote!(::stampfly_bus::NewestOutput<'b, #message, { #depth }, #words>);
        }
        quote!(::stampfly_bus::Publisher<'b, #message, #policy, { #depth }, #words, #required>)
    }

    pub fn subscriber_type(&self) -> TokenStream {
        let (message, policy, depth, words) = (&self.message, self.policy_type(), self.depth(), self.words());
        quote!(::stampfly_bus::Subscriber<'b, #message, #policy, { #depth }, #words>)
    }

    /// What a runnable reads from: the newest sample, or every one since its last activation.
    pub fn input_type(&self) -> TokenStream {
        let (message, policy, depth, words) = (&self.message, self.policy_type(), self.depth(), self.words());
        match self.policy {
            Policy::Latest => quote!(::stampfly_bus::NewestInput<'b, #message, { #depth }, #words>),
            Policy::Ring(_) | Policy::Queue(_) => {
                quote!(::stampfly_bus::SamplesInput<'b, #message, #policy, { #depth }, #words>)
            }
        }
    }
}

impl Participant<'_> {
    pub fn ends(&self) -> Ident {
        type_name(self.name, "Ends")
    }

    /// What its ends know from one activation to the next; whoever is outside keeps its ends.
    pub fn ports(&self) -> Ident {
        type_name(self.name, "Ports")
    }
}
